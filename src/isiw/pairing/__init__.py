"""Using a window: pairs at the best ISI with pulses of TMS alone before and after, and what a log says of them."""

"""From waveforms to numbers: impact, MEP, background, and the judgement of a trial."""

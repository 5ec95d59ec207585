"""Before any window: the hot spot and the resting motor threshold [Kim2020, 4.2.1]. Names are in the modules."""

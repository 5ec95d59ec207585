"""Names of the engine's fields of a particle, in their order in `isiw/native/source/people.h`; a test compares them."""

from __future__ import annotations

from isiw.native.engine import FIELDS, RESPONSE_LEVELS

NOISE, SHAPE, PRESENT, START, WIDTH, FORM, LOG_FLOOR, FLOOR_SD, LOG_RATIO, SPREAD, OUTPUT_SD = range(11)
BOOST, REST, ONSET, MOST, LEAST, DRIFT, STARTLED, SLOPE, LOW_START, LOW_WIDTH, DEPTH = range(11, 22)
CHANGED, STEP, STEP_DRIVE, FADING, STEP_SCALE = range(22, 27)
LEVEL_AT, LEVEL_MEAN, LEVEL_SD = range(27, FIELDS, RESPONSE_LEVELS)

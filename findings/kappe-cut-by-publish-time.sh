#!/usr/bin/env bash
# kappe cut drops MCAP messages whose publish time is not their log time, and those without a schema.
#
# Expected: its README: start and end of a split are compared with the log time. MCAP specification: log_time is when a message
#   was recorded, publish_time when it was published, by the publisher's clock; a channel may have no schema
#   (schema_id 0), as a JSON channel has that describes itself.
# Seen: the split is found by publish_time, after a window of log_time was read. A message that was published one second before it
#   was recorded is in the wrong part or in none; if the publisher counts from its own start all parts are empty.
#   Messages without a schema are in no part. It says nothing and ends well.
# Hurts: recordings of devices with a clock of their own, and logs in plain JSON: after a cut into blocks the pulses are gone,
#   or those of the last second of a block are in the next one.
# (kappe is installed without its readers of ROS messages, which a cut does not need.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    mcap==1.6.0 pydantic==2.14.4 tqdm==4.70.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps kappe==0.25.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import json
import sys
from pathlib import Path

from kappe.cut import CutSettings, CutSplits, cutter
from mcap.reader import make_reader
from mcap.writer import Writer

START_S = 1_700_000_000
blocks = [CutSplits(start=START_S - 0.5, end=START_S + 4.5, name="a"), CutSplits(start=START_S + 4.5, end=START_S + 9.5, name="b")]
seen = {}
for name, published_s, schema in (
    ("published as recorded", START_S, True),
    ("published 1 s before", START_S - 1, True),
    ("published by the device's clock", 0, True),
    ("without a schema", START_S, False),
):
    with open("log.mcap", "wb") as file:
        writer = Writer(file)
        writer.start()
        schema_id = writer.register_schema("Pulse", "jsonschema", b'{"type": "object"}') if schema else 0
        channel = writer.register_channel("pulses", "json", schema_id)
        for pulse in range(10):  # one a second
            data = json.dumps({"pulse": pulse}).encode()
            writer.add_message(channel, (START_S + pulse) * 10**9, data, (published_s + pulse) * 10**9, pulse)
        writer.finish()
    cutter(Path("log.mcap"), Path("parts"), CutSettings(progress=False, splits=[one.model_copy() for one in blocks]))
    parts = [make_reader(open(f"parts/{part}.mcap", "rb")).iter_messages() for part in "ab"]
    seen[name] = [[json.loads(message.data)["pulse"] for _, _, message in part] for part in parts]
    print(f"{name}: {seen[name]}")
print("kappe", meta.version("kappe"), "mcap", meta.version("mcap"))
first, second = [0, 1, 2, 3, 4], [5, 6, 7, 8, 9]
still = list(seen.values()) == [[first, second], [[1, 2, 3, 4, 5], [6, 7, 8, 9]], [[], []], [[], []]]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY

#!/usr/bin/env bash
# @bunchmark/stats (npm) sorts as text before its Mann-Whitney test: in ms p is 0.18 for 0.0185, in hundreds of ms it is right.
#
# Expected: README: mwu(A: number[], B: number[]) is the Mann-Whitney U test. U is the number of pairs in which one is above the other, and
#   does not depend on the unit. The package's own mwUnaive, without sorting, and the same values as Float64Array say the same.
# Seen: plain lists are sorted by JavaScript's default, as text, so that 103 stands before 70. Twenty times from 70 to 127 ms
#   against the same 15 ms later have U = 250 for 287.5. Where all values have the same number of digits it is right.
# Hurts: reaction times or ratings that pass 10, 100 or 1000: p depends on the unit, mostly too large.
# (Needs node and npm.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
npm install --silent --no-fund --no-audit @bunchmark/stats@1.0.0-pre-5 >/dev/null
cat >check.mjs <<'JS'
import { readFileSync } from "node:fs";
import { mwu, mwUnaive } from "@bunchmark/stats";

const early = [...Array(20).keys()].map((i) => 70 + 3 * i);
const late = early.map((value) => value + 15);
let pairs = 0;
for (const one of early) for (const other of late) pairs += one < other ? 1 : one === other ? 0.5 : 0;
const seen = {};
for (const [unit, scale] of [["ms", 1], ["hundreds of ms", 0.01]]) {
  const [a, b] = [early, late].map((values) => values.map((value) => value * scale));
  const [text, naive, typed] = [mwu(a, b), mwUnaive(a, b), mwu(Float64Array.from(a), Float64Array.from(b))];
  seen[unit] = [text.U, naive.U, typed.U];
  console.log(`in ${unit}: U ${text.U}, p ${text.p.toFixed(4)}; mwUnaive ${naive.U}, ${naive.p.toFixed(4)}; as Float64Array ${typed.U}`);
}
console.log("pairs in which the first is earlier:", pairs);
console.log("@bunchmark/stats", JSON.parse(readFileSync("node_modules/@bunchmark/stats/package.json")).version);
const right = pairs === 287.5 && JSON.stringify(seen["hundreds of ms"]) === JSON.stringify([287.5, 287.5, 287.5]);
const still = right && JSON.stringify(seen.ms) === JSON.stringify([250, 287.5, 287.5]);
console.log(still ? "as described" : "CHANGED");
process.exit(still ? 0 : 1);
JS
node check.mjs

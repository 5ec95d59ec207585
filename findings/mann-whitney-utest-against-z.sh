#!/usr/bin/env bash
# mann-whitney-utest (npm) compares U with z: one value against another is significant, thirty against thirty is not.
#
# Expected: its documentation: "to test whether the result is significant, use the significant method. This tests the U-value
#   against an approximate critical value"; criticalValue follows the normal approximation, whose result is z, to be
#   compared with 1.96.
# Seen: significant is true if the smaller U is less than z. U is 0 and z is 1 for one value against another: significant. For
#   thirty against thirty that differ by one SD U is 207 and z is 3.6 (p = 0.0003): not significant. So is it in the
#   fork @tainakanchu/mann-whitney-utest.
# Hurts: tests in a browser's experiment: only samples of a few without any overlap are "significant".
# (Needs node and npm.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
npm install --silent --no-fund --no-audit mann-whitney-utest@1.0.5 @tainakanchu/mann-whitney-utest@1.1.0 >/dev/null
cat >check.js <<'JS'
const names = ["mann-whitney-utest", "@tainakanchu/mann-whitney-utest"];
const quantiles = [...Array(30).keys()].map((i) => {
  // Logistic quantiles, scaled to an SD of about one.
  const share = (i + 0.5) / 30;
  return Math.log(share / (1 - share)) / 1.8;
});
const cases = {
  "one against another": [[1], [2]],
  "two against two": [[1, 2], [3, 4]],
  "thirty against thirty, one SD apart": [quantiles, quantiles.map((value) => value + 1)],
};
const seen = {};
for (const name of names) {
  const mwu = require(name);
  seen[name] = Object.entries(cases).map(([what, samples]) => {
    const u = mwu.test(samples);
    const [smaller, z] = [Math.min(...u), mwu.criticalValue(u, samples)];
    console.log(`${name}, ${what}: U ${smaller}, z ${z.toFixed(2)}, significant ${mwu.significant(u, samples)}`);
    return [mwu.significant(u, samples), z > 1.96];
  });
  console.log(name, require(`${name}/package.json`).version);
}
const described = JSON.stringify([[true, false], [true, false], [false, true]]);
const still = names.every((name) => JSON.stringify(seen[name]) === described);
console.log(still ? "as described" : "CHANGED");
process.exit(still ? 0 : 1);
JS
node check.js

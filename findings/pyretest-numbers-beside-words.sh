#!/usr/bin/env bash
# pyretest loses numeric answers if another question has words: identical answers have a weighted kappa of 0.33.
#
# Expected: docstring of pooled_cohen_kappa: samples are lists of answers, questions name the values of each (any kind);
#   weighted versions for ordered values. Answers that are all the same have a kappa of 1.
# Seen: all answers are put in one array, so that numbers become text as soon as one question is answered in words. The values
#   1 to 5 are then compared with "1" to "5": no answer to that question is counted. Without weights it is right.
# Hurts: questionnaires with a scale and a yes-or-no question: the reliability of the scale is left out of the agreement, and
#   sample sizes are planned with it.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 pandas==3.0.3 tqdm==4.70.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pyretest==1.3
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

from pyretest import Question, pooled_cohen_kappa, sample_questionnaire

scale, words, coded = Question([1, 2, 3, 4, 5], [0.2] * 5), Question(["yes", "no"], [0.5, 0.5]), Question([1, 0], [0.5, 0.5])
seen = {}
for name, questions in (("scale alone", [scale]), ("scale and 1/0", [scale, coded]), ("scale and yes/no", [scale, words])):
    answers = sample_questionnaire(questions, 50, seed=1)
    seen[name] = [pooled_cohen_kappa(answers, answers, weight, questions) for weight in ("linear", "quadratic", None)]
    print(f"{name}, the same answers twice: kappa linear {seen[name][0]:.2f}, quadratic {seen[name][1]:.2f}, unweighted {seen[name][2]:.2f}")
print("pyretest", meta.version("pyretest"))
still = all(abs(one - 1) < 1e-9 for name in ("scale alone", "scale and 1/0") for one in seen[name])
still &= max(seen["scale and yes/no"][:2]) < 0.5 and abs(seen["scale and yes/no"][2] - 1) < 1e-9
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY

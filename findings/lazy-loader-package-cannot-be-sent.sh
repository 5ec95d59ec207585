#!/usr/bin/env bash
# A package that loads its parts lazily, and has a function of the name of its module, cannot be sent to joblib's or
# Dask's workers: a script whose function uses it works alone, and raises with two workers.
#
# Expected: cloudpickle's README: modules that can be imported are sent by reference, so that a function of a script may
#   use any package. lazy-loader's README: packages behave as with ordinary imports, only later.
# Seen: lazy-loader 0.6 gives such a package another class, of which cloudpickle knows nothing: TypeError: cannot pickle
#   '_ShadowGuardModule' object. Where no function is called like its module, the same script runs.
# Hurts: analyses and simulations of many people, which run in one process and fail on a cluster, with a message that
#   names neither package nor function.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check lazy-loader==0.6 joblib==1.5.2 cloudpickle==3.1.3
cd "$tmp"
for package in filtered:filtered meps:amplitude; do
  module=${package%:*} function=${package#*:}
  mkdir -p "lab_$module/signals"
  echo "" > "lab_$module/__init__.py"
  echo "def $function(x): return 2 * x" > "lab_$module/signals/$module.py"
  cat > "lab_$module/signals/__init__.py" <<PY
import lazy_loader
__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, submod_attrs={"$module": ["$function"]})
PY
  cat > "$module.py.txt" <<PY
import lab_$module.signals
from joblib import Parallel, delayed

def person(number):
    return lab_$module.signals.$function(number)

print([person(number) for number in range(3)], Parallel(n_jobs=2)(delayed(person)(number) for number in range(3)))
PY
done
seen() { "$tmp/venv/bin/python" -W ignore "$1.py.txt" 2>&1 | grep -E "^\[|^TypeError" | tail -n 1; }
same=$(seen filtered || true)
other=$(seen meps)
echo "function and module of one name:    $same"
echo "function and module of two names:   $other"
fine="[0, 2, 4] [0, 2, 4]"
if [ "$same" = "TypeError: cannot pickle '_ShadowGuardModule' object" ] && [ "$other" = "$fine" ]; then
  echo "as described"
else
  echo "CHANGED"
  exit 1
fi

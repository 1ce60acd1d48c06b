#!/usr/bin/env bash
# Numba 0.68.1 compiles for the host's vector units although NUMBA_CPU_NAME names a processor without them.
#
# Guess: NUMBA_CPU_NAME=nehalem, a processor of 2008 without AVX, gives code that runs on any newer one. Seen: name and
# features are separate. Without NUMBA_CPU_FEATURES the features are those of the host, so that code for a mixed cluster
# still has AVX registers; NUMBA_CPU_FEATURES must be set as well, to an empty text.
set -euo pipefail
if ! grep -q -m1 -w avx /proc/cpuinfo; then
    echo "skipped: this processor has no AVX"
    exit 0
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet numba==0.68.1
cat > count.py <<'PYTHON'
import re

import numba
import numpy as np


@numba.njit(fastmath=True)
def total(x):
    s = 0.0
    for each in x:
        s += each * each
    return s


total(np.ones(64))
(assembly,) = total.inspect_asm().values()
print(len(re.findall(r"%[yz]mm\d", assembly)))
PYTHON
host=$(venv/bin/python count.py)
named=$(NUMBA_CPU_NAME=nehalem venv/bin/python count.py)
both=$(NUMBA_CPU_NAME=nehalem NUMBA_CPU_FEATURES= venv/bin/python count.py)
echo "uses of AVX registers: host $host, NUMBA_CPU_NAME=nehalem $named, with empty NUMBA_CPU_FEATURES $both"
[ "$host" -gt 0 ] && [ "$named" -gt 0 ] && [ "$both" -eq 0 ]

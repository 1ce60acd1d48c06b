#!/usr/bin/env bash
# windIO 2.1.1 calls a turbine file valid whatever version of windIO it says it is, and with angles in either unit.
#
# Guess: the validator, which insists on windIO_version, compares it with its own schema. From 1.0 to 2.0 angles became
# degrees; the cone and the tilt kept their names. Seen: the example of 15 MW is valid as "1.0" and as "99.0" too, and
# with the cone in radians, as 1.0 had it: 4 degrees become 0.07 degrees without a word.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet windIO==2.1.1
venv/bin/python - <<'PYTHON'
from math import radians
from pathlib import Path

import windIO

turbine = windIO.load_yaml(Path(windIO.__file__).parent / "examples" / "turbine" / "IEA-15-240-RWT.yaml")
hub = turbine["components"]["hub"]
degrees = hub["cone_angle"]
seen = []
for version in ("2.0", "1.0", "99.0"):
    for cone in (degrees, radians(degrees)):
        turbine["windIO_version"], hub["cone_angle"] = version, cone
        try:
            windIO.validate(turbine, "turbine/turbine_schema")
            seen.append(True)
        except Exception as error:
            seen.append(False)
            print(error)
        print(f"windIO_version {version}, cone_angle {cone:.3g}: {'valid' if seen[-1] else 'not valid'}")
raise SystemExit(0 if all(seen) else 1)
PYTHON

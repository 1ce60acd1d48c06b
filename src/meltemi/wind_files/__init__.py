"""Wind files: one module per format; the table of the formats is ``meltemi.wind_files.formats``."""

from __future__ import annotations

from meltemi.wind_files.bladed import read_bladed as read_bladed
from meltemi.wind_files.bladed import write_bladed as write_bladed
from meltemi.wind_files.bts import read_bts as read_bts
from meltemi.wind_files.bts import write_bts as write_bts
from meltemi.wind_files.hawc2 import Hawc2Grid as Hawc2Grid
from meltemi.wind_files.hawc2 import read_hawc2 as read_hawc2
from meltemi.wind_files.hawc2 import write_hawc2 as write_hawc2
from meltemi.wind_files.hub_csv import hub_series as hub_series
from meltemi.wind_files.hub_csv import read_hub_csv as read_hub_csv
from meltemi.wind_files.hub_csv import write_hub_csv as write_hub_csv
from meltemi.wind_files.netcdf import read_wind_netcdf as read_wind_netcdf
from meltemi.wind_files.netcdf import write_wind_netcdf as write_wind_netcdf
from meltemi.wind_files.uniform import read_wnd as read_wnd
from meltemi.wind_files.uniform import write_wnd as write_wnd

KERNELS = ()

"""Result files: one module per format; the table of the formats is ``meltemi.postprocess.formats``."""

from __future__ import annotations

from meltemi.postprocess.files.netcdf import read_netcdf as read_netcdf
from meltemi.postprocess.files.netcdf import write_netcdf as write_netcdf
from meltemi.postprocess.files.out import read_out as read_out
from meltemi.postprocess.files.out import write_out as write_out
from meltemi.postprocess.files.outb import read_outb as read_outb
from meltemi.postprocess.files.outb import write_outb as write_outb
from meltemi.postprocess.formats import read_result as read_result
from meltemi.postprocess.formats import write_result as write_result

"""Turbines as OpenFAST decks."""

from meltemi.studies.openfast_writer.writer import Written as Written
from meltemi.studies.openfast_writer.writer import write_openfast as write_openfast

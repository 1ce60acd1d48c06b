"""Turbines as OpenFAST decks."""

from meltemi.exchange.openfast_writer.writer import Written as Written
from meltemi.exchange.openfast_writer.writer import write_openfast as write_openfast

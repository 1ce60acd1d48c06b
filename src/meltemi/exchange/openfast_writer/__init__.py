"""Export of turbines as OpenFAST decks."""

from meltemi.exchange.openfast_writer.writer import ExportedDeck as ExportedDeck
from meltemi.exchange.openfast_writer.writer import write_openfast as write_openfast

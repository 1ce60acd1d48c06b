"""Import of OpenFAST decks."""

from meltemi.turbine.openfast.deck import Deck as Deck
from meltemi.turbine.openfast.deck import read_deck as read_deck
from meltemi.turbine.openfast.deck import read_openfast as read_openfast

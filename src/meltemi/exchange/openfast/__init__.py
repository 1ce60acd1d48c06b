"""Import of OpenFAST decks."""

from meltemi.exchange.openfast.deck import Deck as Deck
from meltemi.exchange.openfast.deck import read_deck as read_deck
from meltemi.exchange.openfast.deck import read_openfast as read_openfast

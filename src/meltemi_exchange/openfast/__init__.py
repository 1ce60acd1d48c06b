"""Import of OpenFAST decks."""

from meltemi_exchange.openfast.deck import Deck as Deck
from meltemi_exchange.openfast.deck import read_deck as read_deck
from meltemi_exchange.openfast.deck import read_openfast as read_openfast

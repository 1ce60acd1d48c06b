"""Import of HAWC2 models."""

from meltemi.exchange.hawc2.model import import_hawc2 as import_hawc2
from meltemi.exchange.hawc2.model import read_hawc2_model as read_hawc2_model

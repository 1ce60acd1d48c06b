"""Export of controllers as shared libraries with the Bladed interface."""

from meltemi.exchange.controller_library.library import ExportedController as ExportedController
from meltemi.exchange.controller_library.library import export_controller as export_controller

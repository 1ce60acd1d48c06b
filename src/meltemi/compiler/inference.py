"""Numba's type inference, with the signatures that it found remembered.

For each call of an operator Numba tries its templates, up to a hundred, until one applies: for 15,000 calls in the
kernels of a first run, of which 600 differ. This takes a quarter of the time of their compilation.
"""

from typing import Any
from weakref import WeakKeyDictionary

from numba.core import targetconfig
from numba.core.types.functions import BaseFunction

_search = BaseFunction.get_call_type
_SIGNATURES: WeakKeyDictionary[Any, Any] = WeakKeyDictionary()
"""By type of the function, not in it: the type is pickled with compiled code that refers to it."""


def _remembered(self: BaseFunction, context: Any, args: Any, kws: Any) -> Any:
    """Signature of a call, as ``BaseFunction.get_call_type``, under the settings of the present compilation."""
    flags = targetconfig.ConfigStack.top_or_none()
    settings = flags and tuple(f"{name} {getattr(flags, name)}" for name in flags.options if flags.is_set(name))
    known, key = _SIGNATURES.setdefault(self, {}), (context, tuple(args), tuple(kws.items()), settings)
    if key not in known:
        known[key] = _search(self, context, args, kws)
    return known[key]


BaseFunction.get_call_type = _remembered  # type: ignore[method-assign]

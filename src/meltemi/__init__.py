"""meltemi: flexible wind turbines in turbulent wind, under control, and their loads.

    import meltemi

    turbine = meltemi.load_turbine("nrel5mw")
    model = meltemi.build(turbine)
    result = meltemi.simulate(model, meltemi.SteadyWind(speed=12.0), duration=60.0)
    meltemi.plot(result).savefig("run.png")

Names are imported when they are first used, so ``import meltemi`` is quick.
"""

from meltemi.namespaces import public

__version__ = "0.1.0"
__getattr__, __dir__ = public(__name__)

"""Effect of the weather at a site on annual energy and lifetime loads of a turbine with blades.

``weather`` has the periods of a year, months of a climate or hours of a weather file; ``response`` simulates what the
turbine does over wind speed, density, rain and ice; ``year`` puts both together; ``tables`` says it.
"""

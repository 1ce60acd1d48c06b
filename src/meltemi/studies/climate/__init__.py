"""Effect of the weather at a site on annual energy and lifetime loads of a turbine with blades.

``weather`` has the periods of a year, months of a climate or hours of a weather file; ``response`` simulates the
turbine over wind speed, density, rain and ice; ``year`` combines both; ``tables`` presents the results.
"""

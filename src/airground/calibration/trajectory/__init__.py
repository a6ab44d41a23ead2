"""The whole drive as one estimation problem: g, the robots' positions and the nuisances together.

Unknown are g, where every robot was at each of its sightings, and what real recordings get wrong (clock, lens,
headings, speeds, the place of the tracked point). Residuals are pixels and odometry increments. As all positions are
free, the ground's origin is pure gauge and is put under the middle of the sightings.
"""

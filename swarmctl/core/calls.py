"""Kernels that Python calls by themselves, compiled once and cached; those of the loop are bound in bind.py.

Calling a kernel of the other modules directly would compile it anew in every process.
"""

from . import geodesy, homing, know, randoms, roam, scene, steering, wire
from .bind import compiled

to_local = compiled(geodesy.to_local)
to_geodetic = compiled(geodesy.to_geodetic)
uniform = compiled(randoms.uniform)
uniforms = compiled(randoms.uniforms)
place_centres = compiled(scene.place_centres)
lay_out = compiled(scene.lay_out)
bounds = compiled(scene.bounds)
lay_ways = compiled(roam.lay_ways)
stray = compiled(roam.stray)
sort_into = compiled(scene.sort_into)
order_home = compiled(homing.order_home)
steer = compiled(steering.steer)
read_poses = compiled(wire.read_poses)
index = compiled(know.index)

"""The rooms by name, each a function of a seed."""

from .dry_rooms import bedroom, hall, office
from .study import study
from .wet_rooms import bathroom, kitchen

ROOMS = {one.__name__: one for one in (kitchen, bathroom, bedroom, office, hall, study)}

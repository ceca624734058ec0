"""The rooms by name, each a function of a seed."""

from .dry_rooms import bedroom, hall, office
from .study import study
from .wet_rooms import bathroom, kitchen

ROOMS = {make.__name__: make for make in (kitchen, bathroom, bedroom, office, hall, study)}

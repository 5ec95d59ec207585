from . import catalogue as catalogue
from . import settings as settings
from . import stopping as stopping
from . import threshold as threshold
from .catalogue import list_strategies as list_strategies
from .catalogue import make_strategy as make_strategy
from .recipe import Recipe as Recipe
from .strategy import Strategy as Strategy

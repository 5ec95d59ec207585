from .meps import MepLaw as MepLaw
from .model import ParametricModel as ParametricModel
from .model import ParametricPosterior as ParametricPosterior

from . import interval as interval
from . import repeatability as repeatability
from . import response_counts as response_counts

from meltemi.learning.gym import IDS as IDS
from meltemi.learning.gym import TurbineEnv as TurbineEnv
from meltemi.learning.gym import TurbineVectorEnv as TurbineVectorEnv
from meltemi.learning.gym import make_vec as make_vec
from meltemi.learning.settings import TEST_SEEDS as TEST_SEEDS
from meltemi.learning.settings import TRAINING_SEEDS as TRAINING_SEEDS
from meltemi.learning.settings import EnvironmentSettings as EnvironmentSettings
from meltemi.learning.settings import Weights as Weights

from meltemi_learning.gym import IDS as IDS
from meltemi_learning.gym import TurbineEnv as TurbineEnv
from meltemi_learning.gym import TurbineVectorEnv as TurbineVectorEnv
from meltemi_learning.gym import make_vec as make_vec
from meltemi_learning.settings import TEST_SEEDS as TEST_SEEDS
from meltemi_learning.settings import TRAINING_SEEDS as TRAINING_SEEDS
from meltemi_learning.settings import EnvironmentSettings as EnvironmentSettings
from meltemi_learning.settings import Weights as Weights

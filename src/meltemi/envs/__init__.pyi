from meltemi.envs.gym import IDS as IDS
from meltemi.envs.gym import TurbineEnv as TurbineEnv
from meltemi.envs.gym import TurbineVectorEnv as TurbineVectorEnv
from meltemi.envs.gym import make_vec as make_vec
from meltemi.envs.settings import TEST_SEEDS as TEST_SEEDS
from meltemi.envs.settings import TRAINING_SEEDS as TRAINING_SEEDS
from meltemi.envs.settings import EnvironmentSettings as EnvironmentSettings
from meltemi.envs.settings import Weights as Weights

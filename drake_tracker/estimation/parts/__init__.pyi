from .alpha_beta_gamma_filter import AlphaBetaGammaFilter as AlphaBetaGammaFilter
from .turn_filter import TurnFilter as TurnFilter

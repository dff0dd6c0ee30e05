from .chessboard import Chessboard as Chessboard

from .figures import draw_tracking as draw_tracking

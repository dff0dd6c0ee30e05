"""An object that passes behind a pillar, followed by the whole of `drake-tracker track` with default settings, for
`footage.py`."""

import numpy as np
from footage_parts.clips import HIDDEN_KINDS, make_clip
from footage_parts.fast import tracked

CELLS = HIDDEN_KINDS


def job(cell, seed, quick):
    """Returns the line of a clip, as `footage.job` does.

    An image counts as missed if the whole object can be seen, and has no place; a place counts wherever there is one.
    The identity is kept if the object has the same number before and after.
    """
    clip = make_clip(cell, seed)
    numbers, places, seen, identities = tracked(clip)
    truth = clip.truth[numbers, 0]
    left, right = clip.pillar
    whole = (truth[:, 0] + 0.5 * clip.size < left) | (truth[:, 0] - 0.5 * clip.size >= right)
    known = identities[seen & np.isfinite(identities)]
    return {
        "errors_px": np.hypot(*(places - truth).T)[seen].tolist(),
        "missed": int((whole & ~seen).sum()),
        "size_px": clip.size,
        "kept": bool(len(known) and known[0] == known[-1]),
    }

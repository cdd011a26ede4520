"""Read pickles, joblib dumps, ``.npy``/``.npz`` and torch files of strangers without running anything in them.

A pickle is a small program that may call whatever it names. Here it is only *interpreted*: a stack machine of our own
(``machine``) knows the few constructions that hold plain data (``recipes``) and refuses every other name, so nothing is
imported, looked up or called on the file's behalf. Neither joblib nor torch nor scipy is needed.
"""

from markerscope.solver.safe_pickle.files import load_untrusted
from markerscope.solver.safe_pickle.sparse import Sparse

__all__ = ["Sparse", "load_untrusted"]

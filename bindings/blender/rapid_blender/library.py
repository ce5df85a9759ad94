"""The Python module of Rapid: the one in the add-on's zip, or else the one that is installed."""
import importlib
import pathlib

HERE = pathlib.Path(__file__).resolve().parent
_module = None


def load():
    """Returns the module rapid. Raises ImportError with the cause if it or its library cannot be loaded."""
    global _module
    if _module is None:
        bundled = (HERE / "lib/rapid/__init__.py").exists()
        try:
            _module = importlib.import_module(".lib.rapid", __package__) if bundled else importlib.import_module("rapid")
        except (ImportError, OSError) as error:
            source = "of this add-on" if bundled else "(install Debian's package rapid, or the add-on's zip)"
            raise ImportError(f"Rapid's library {source} cannot be loaded: {error}") from error
    return _module

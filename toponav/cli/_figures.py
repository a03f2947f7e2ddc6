"""Figures written whole or not at all."""

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toponav.core.files import write_atomically

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["save_figure"]


def save_figure(figure: "Figure", path: Path, **options: Any) -> None:
    """Draw a figure into a file, in the format that its name ends in.

    Raises:
        InputError: If the file cannot be written.
    """
    picture = io.BytesIO()
    figure.savefig(picture, format=path.suffix.lower().removeprefix("."), **options)
    write_atomically(path, picture.getvalue())

"""Figures as files: as large as they were drawn, with text of 12 points, or for the columns of a paper, with 8."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from hydrone_gym._whole_file import whole
from hydrone_gym.rendering import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Width = float | Literal["column", "text"]  # inches, or by name
_NAMED = {"column": 3.5, "text": 7.16}  # inches, in journals with two columns
_LEAST, _MOST = 2.0, 20.0  # inches
_PAPER = 8.0 / 12.0  # size of text on paper
_PAPER_DOTS = 400  # an inch
_POINTS = 72.0  # an inch


def inches(width: Width | None) -> float | None:
    """Return a width in inches; ValueError for one that no figure can have."""
    number = _NAMED[width] if isinstance(width, str) else width
    if number is not None and not _LEAST <= number <= _MOST:
        raise ValueError(f"width must be column, text or from {_LEAST:g} to {_MOST:g} inches, got {number:g}")
    return number


def drawn_width(width: float | None, usual: float) -> float:
    """Return how wide to draw a figure that is so wide (inches) on paper, None where it is not for paper."""
    return usual if width is None else width / _PAPER


def save_figure(
    figure: Figure,
    path: str | Path,
    *,
    width: float | None = None,
    titled: bool = True,
    formats: Sequence[str] = ("png", "pdf"),
) -> list[Path]:
    """Write a figure beside `path` (no suffix) in some formats, png, pdf or svg, and return the paths.

    With a width (inches) it is laid out for it, its text of 8 points. Equal figures give equal files. The folder must
    exist.

    Raises OSError naming the file that cannot be written.
    """
    written = [Path(f"{path}.{suffix}") for suffix in formats]
    scale, dots = (1.0, style.DOTS_PER_INCH) if width is None else (_PAPER, _PAPER_DOTS)
    before = figure.get_figwidth()
    for text in figure.texts:
        text.set(visible=titled, in_layout=titled)
    figure.set_figwidth(drawn_width(width, before))
    for target in written:
        with whole(target) as file:
            if target.suffix == ".svg":
                file.write_text(to_svg(figure, target.stem, scale), encoding="utf-8")
            elif target.suffix == ".pdf":
                with style.applied():
                    _write_pdf(figure, file, scale)
            else:
                figure.savefig(file, dpi=scale * dots, pil_kwargs={"dpi": (dots, dots)})
    figure.set_figwidth(before)
    for text in figure.texts:
        text.set(visible=True, in_layout=True)
    return written


def to_svg(figure: Figure, salt: str, scale: float = 1.0) -> str:
    """Return a figure as SVG whose text stays text; equal figures of equal `salt` give equal bytes."""
    stream = io.StringIO()
    with style.applied(salt):
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    if scale == 1.0:
        return stream.getvalue()
    size = " ".join(f'{name}="{_POINTS * scale * side:g}pt"' for name, side in zip(("width", "height"), _size(figure)))
    return re.sub(r'(<svg [^>]*?)width="[^"]*" height="[^"]*"', rf"\1{size}", stream.getvalue(), count=1)


def _size(figure: Figure) -> tuple[float, float]:
    width, height = figure.get_size_inches()
    return float(width), float(height)


def _write_pdf(figure: Figure, path: Path, scale: float) -> None:
    """Write a figure as PDF, everything in it scaled: `savefig` knows no such thing."""
    from matplotlib.backends import backend_pdf as pdf

    width, height = _size(figure)
    figure.draw_without_rendering()  # lays out
    dots, figure.dpi = figure.dpi, _POINTS
    file: Any = pdf.PdfFile(str(path), metadata={"CreationDate": None})
    try:
        file.newPage(scale * width, scale * height)
        file.output(scale, 0, 0, scale, 0, 0, pdf.Op.concat_matrix)
        page = pdf.RendererPdf(file, dots, height, width)
        renderer = pdf.MixedModeRenderer(figure, width, height, dots, page)
        figure.draw(renderer)
        renderer.finalize()
        file.finalize()
    finally:
        file.close()
        figure.dpi = dots

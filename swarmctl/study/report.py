"""What a study leaves behind: study.json, mission.yaml and charts in its folder, tables for the terminal."""

from collections.abc import Sequence

from swarmctl.mission.dump import dump
from swarmctl.record.folder import RunFolder

from . import tables
from .figures import CellFigures, figures_of_cell, study_json
from .plan import merged
from .settings import shown
from .study import Study

RESULT = "study.json"


def figures_of_study(study: Study) -> list[CellFigures]:
    """The figures of every cell of which anything is finished."""
    return [figures_of_cell(cell, runs) for cell, runs in study.cells]


def write(study: Study, cells: Sequence[CellFigures], folder: RunFolder) -> dict[str, object]:
    """Write the study's files, figures first; returns what is in study.json.  Raises RunFolderError."""
    content = study_json(study, cells, str(folder.path))
    folder.write_json(folder.path / RESULT, content)
    folder.write_text(folder.mission, dump(merged(cells[0].cell)))
    # The drawing library is loaded only now: an interruption meanwhile costs no figures.
    from . import charts, grid_charts

    if study.plan.varied:
        grid_charts.draw_grid(folder.path, study.plan, cells)
    else:
        charts.draw_runs(folder.path, cells[0])
    return content


def text(study: Study, cells: Sequence[CellFigures]) -> str:
    """The tables: all of a single cell, or a row for each of many."""
    plan = study.plan
    if plan.varied:
        return tables.render(tables.of_grid(cells))
    given = cells[0].cell.settings
    head = f"{shown(given)}\n\n" if given else ""
    return head + tables.render(tables.of_cell(cells[0], len(plan.seeds)))

"""The list of what is in a room as tables, as a page to print, and as a plan."""

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.formats import kind_of
from langflash_core.inventory import inventory
from langflash_core.inventory.plan import floor_plan
from langflash_core.writing.inventory.cutouts import cutouts_of
from langflash_core.writing.inventory.drawing import plan_svg
from langflash_core.writing.inventory.dxf import plan_dxf
from langflash_core.writing.inventory.page import page_of
from langflash_core.writing.inventory.tables import table_csv, table_json
from langflash_core.writing.job import Job, plural


def write_inventory(job: Job) -> str:
    """The things of the room as .csv, .json or a page to print.

    Raises:
        LangFlashError: the scene holds nothing or has no language, or the file cannot be written.
    """
    job.progress("looking for things", 0.1)
    found = inventory(job.scene, threshold=job.request.threshold)
    kind = kind_of(job.request.output)
    if kind == ".html":
        plan = floor_plan(found)
        with job.renderer() as renderer:
            cutouts = cutouts_of(found, renderer, job.progress)
        content = page_of(found, plan, cutouts, (job.request.scene or job.request.output).stem)
    else:
        content = table_csv(found) if kind == ".csv" else table_json(found, floor_plan(found))
    make_folder(job.request.output.parent)
    write_atomically(job.request.output, content.encode())
    return f"{plural(len(found.things), 'thing')} of {plural(len(found.counts), 'kind')}"


def write_plan(job: Job) -> str:
    """The room from above, to scale, as .svg or .dxf.

    Raises:
        LangFlashError: the scene holds nothing or has no language, or the file cannot be written.
    """
    job.progress("looking for things", 0.1)
    plan = floor_plan(inventory(job.scene, threshold=job.request.threshold))
    title = (job.request.scene or job.request.output).stem
    drawn = plan_svg(plan, title) if kind_of(job.request.output) == ".svg" else plan_dxf(plan)
    make_folder(job.request.output.parent)
    write_atomically(job.request.output, drawn.encode())
    return f"{plural(len(plan.walls), 'wall')}, {plural(len(plan.things), 'thing')}"

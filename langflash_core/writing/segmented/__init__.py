"""A folder with every view of a scene taken apart by phrases."""

from langflash_core.writing.job import Job
from langflash_core.writing.segmented.folder import write_folder
from langflash_core.writing.subject import taken_apart


def write_segmented(job: Job) -> str:
    """The folder of every photo's view, or of the one that is named.

    Raises:
        LangFlashError: nothing answers, or the folder cannot be written.
    """
    cameras = job.cameras()
    numbers = list(range(len(cameras))) if job.of_photos else [job.choice.view]
    with job.renderer() as renderer:
        subject = taken_apart(job.scene, job.prompts, job.request.threshold, cameras, numbers, renderer)
        return write_folder(subject, job.request, job.progress)

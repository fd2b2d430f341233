"""`langflash clean`: what of a scene is rubbish goes, by strength, by rules, or as a recipe says."""

from argparse import Namespace
from typing import TYPE_CHECKING, TextIO

from langflash_core.base.files import check_output_file, make_folder, readable_file
from langflash_core.errors import InputError
from langflash_core.mending.recipes import KINDS, Recipe, load_recipe, parsed_box, parsed_rule, save_recipe
from langflash_core.mending.settings import RECIPE_DEFAULTS

from ..files import checked_scene
from ..renderers import open_renderer
from ..report import ProgressBar, tell
from ..scenes import open_scene

if TYPE_CHECKING:
    import numpy as np

    from langflash_core.mending.cleaning import Cleaned
    from langflash_core.types import Scene


def run(args: Namespace, out: TextIO) -> None:
    """Clean it up, write the scene, and tell what went."""
    if args.recipe is not None:
        readable_file(args.recipe, "recipe", InputError)
    recipe = _recipe(args)
    checked_scene(args.scene)
    check_output_file(args.output, (".langflash",), inputs=[args.scene])
    taken = [args.scene, args.output, *filter(None, [args.recipe])]
    asked = ((args.preview, ".png", "--preview"), (args.save_recipe, ".json", "--save-recipe"))
    for path, suffix, option in asked:
        if path is not None:
            check_output_file(path, (suffix,), inputs=taken, option=option)

    from langflash_core.export.paint import write_picture
    from langflash_core.mending.cleaning import apply_recipe
    from langflash_core.scene.file import save

    scene = open_scene(args.scene, args.axes)
    with ProgressBar() as progress:
        progress("looking", 0.2)
        found = apply_recipe(scene, recipe)
        done, picture = _done(args, scene, found)
    make_folder(args.output.parent)
    save(done, args.output)
    if picture is not None:
        write_picture(args.preview, picture)
    if args.save_recipe is not None:
        make_folder(args.save_recipe.parent)
        save_recipe(recipe, args.save_recipe)
    counts = {name: count for name, count in found.counts.items() if count}
    total, removed = len(scene.gaussians), int(found.rows.sum())
    filled = len(done.gaussians) - total + removed
    document = {
        "scene": str(args.output),
        "removed": removed,
        "left": total - removed,
        "filled": filled,
        "counts": counts,
        "recipe": recipe.document(),
    }
    lines = [f"{args.output}: {removed:,} of {total:,} Gaussians removed"]
    lines += [f"  {count:,} {name}" for name, count in counts.items()]
    if filled:
        lines.append(f"  {filled:,} in their holes, made of what is around them")
    tell(args, document, lines, out)


def _recipe(args: Namespace) -> Recipe:
    told = {
        "--strength": args.strength, "--kinds": args.kinds, "--where": args.where, "--within": args.within,
        "--invert": args.invert or None, "--crop": args.crop,
    }  # fmt: skip
    given = [name for name, value in told.items() if value is not None]
    if args.recipe is not None:
        if given:
            raise InputError(f"the recipe says what to clean up; leave {given[0]} out, or --recipe")
        recipe = load_recipe(args.recipe)
    else:
        usual = 0.0 if args.where or args.crop else RECIPE_DEFAULTS.strength
        recipe = Recipe(
            strength=usual if args.strength is None else args.strength,
            kinds=tuple(args.kinds or KINDS),
            rules=tuple(parsed_rule(text) for text in args.where or ()),
            within=tuple(args.within or ()),
            invert=args.invert,
            crop=None if args.crop is None else parsed_box(args.crop),
        )
    if recipe.empty:
        raise InputError("a strength of 0 cleans nothing up; choose one above it, a rule or a box")
    return recipe


def _done(args: Namespace, scene: "Scene", found: "Cleaned") -> "tuple[Scene, np.ndarray | None]":
    """The scene without what was found, and its preview where one is asked for."""
    from langflash_core.mending.cleaning import taken_out

    if not args.fill and args.preview is None:
        return taken_out(scene, found.rows), None
    import torch

    from langflash_core.mending.looks import before_and_after

    with open_renderer(args.backend) as renderer:
        done = taken_out(scene, found.rows, renderer if args.fill else None)
        if args.preview is None:
            return done, None
        picture = before_and_after(scene, torch.from_numpy(found.rows), done, renderer)
    return done, (picture * 255).round().byte().numpy()

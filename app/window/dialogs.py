"""Which dialogs there are, and which of them have a path that is typed."""

from enum import Enum


class Dialog(Enum):
    """A dialog of the window; the value is its title."""

    SAVE = "Save the scene"
    OPEN = "Open"
    HELP = "Mouse and keys"
    LEAVE = "Quit?"
    DROP = "Where do these photos belong?"
    DROP_SCENE = "Open or merge?"
    MERGE = "Merge a scene into this one"
    PLACE = "Choose a folder"
    FILM = "Frames of a film"
    UNSAVED = "Edits are not saved"
    SAVE_PROMPTS = "Save the phrases"
    LOAD_PROMPTS = "Load phrases"
    SAVE_RECIPE = "Save the recipe"
    LOAD_RECIPE = "Load a recipe"
    EXPORT = "Export"
    REPLACE = "Replace?"
    SETTINGS = "Preferences"
    LOG = "Log"
    PALETTE = "All commands"

    @property
    def looks(self) -> bool:
        """Whether it shows a folder."""
        return self in (Dialog.OPEN, Dialog.MERGE, Dialog.PLACE)

    @property
    def types(self) -> bool:
        """Whether a path is typed there; the export's lies in its form."""
        return self.looks or self is Dialog.SAVE or self in (*PROMPTS, *RECIPES)


PROMPTS = (Dialog.SAVE_PROMPTS, Dialog.LOAD_PROMPTS)
RECIPES = (Dialog.SAVE_RECIPE, Dialog.LOAD_RECIPE)

"""A session without its window, for tests and for those who kill it."""

from dataclasses import dataclass, field

from app.window.commands import Command, OfScene, Tick, apply
from app.window.effects import Hands
from app.window.recovery.effects import RecoveryEffects
from app.window.recovery.keeper import Keeper
from app.window.requests import Job, SceneTask, Task
from app.window.state import State


@dataclass
class Desk:
    """A session without its window: performs commands, and runs requests when told to."""

    state: State = field(default_factory=State)
    asked: list[Job | Task] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.keeper = Keeper()
        hands = Hands(self.perform, self.perform, self.asked.append, lambda: None, lambda: self.state.now)
        self.effects = RecoveryEffects(hands, self.keeper)

    def perform(self, command: Command) -> None:
        if isinstance(command, OfScene):
            if not command.holds(self.state):
                return
            command = command.command
        before = self.state
        self.state = apply(before, command)
        self.effects.follow(command, before, self.state)

    def work(self) -> None:
        """Everything that was asked of the worker."""
        while self.asked:
            request = self.asked.pop(0)
            if isinstance(request, Job):
                self.perform(request.run(7, lambda *_: None, lambda: False))
                continue
            for command in request.run(lambda: False):
                about = isinstance(request, SceneTask)
                self.perform(OfScene(request.serial, command) if about else command)

    def pass_time(self, seconds: float) -> None:
        self.perform(Tick(self.state.now + seconds))
        self.effects.tick(self.state, self.state.now)

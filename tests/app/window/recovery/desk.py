"""A session without its window, for tests and for those who kill it."""

from dataclasses import dataclass, field

from app.window.commands import Command, OfScene, Tick, apply
from app.window.effects import Effects, Hands
from app.window.recovery.effects import RecoveryEffects, Writer
from app.window.recovery.records import Keeper
from app.window.requests import Job, SceneTask, Task
from app.window.state import State


@dataclass
class Desk:
    """A session without its window: performs commands, and runs requests when told to."""

    state: State = field(default_factory=State)
    asked: list[Job | Task] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.keeper = Keeper()
        self.hands = Hands(
            self.perform, self.perform, self.asked.append, lambda: None, lambda: self.state.now
        )
        self.write = Writer(self.hands)
        self.effects = RecoveryEffects(self.hands, self.keeper, self.write)
        self.followers: list[Effects] = [self.effects]

    def perform(self, command: Command) -> None:
        if isinstance(command, OfScene):
            if not command.holds(self.state):
                return
            command = command.command
        before = self.state
        self.state = apply(before, command)
        after = self.state
        for effects in self.followers:
            effects.follow(command, before, after)

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
        for effects in self.followers:
            effects.tick(self.state, self.state.now)

    def written(self) -> None:
        """Once the writer's thread has done all that it was given."""
        self.write(lambda: None).result()

    def die(self) -> None:
        """The system opens the lock of whoever does."""
        self.effects.close(self.state, crashed=True)
        if self.keeper._lock is not None:
            self.keeper._lock.close()

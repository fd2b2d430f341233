"""A session without its window, for tests and for those who kill it."""

from dataclasses import dataclass, field

from app.window.commands import Command, OfScene, Tick, apply
from app.window.effects import Effects, Hands
from app.window.recovery.effects import RecoveryEffects
from app.window.recovery.records import Keeper
from app.window.requests import Job, SceneTask, Task
from app.window.state import State


class Nothing:
    """In the place of viewport and thumbnails: does nothing."""

    shares = ()

    def __getattr__(self, name: str):
        return lambda *_: None


@dataclass
class Bare:
    """Performs commands, and runs requests when told to; `followers` are the effects that see them."""

    state: State = field(default_factory=State)
    asked: list[Job | Task] = field(default_factory=list)
    followers: tuple[Effects, ...] = ()

    def __post_init__(self) -> None:
        self.hands = Hands(
            self.perform, self.perform, self.asked.append, lambda: None, lambda: self.state.now
        )

    def perform(self, *commands: Command) -> None:
        for command in commands:
            if isinstance(command, OfScene):
                if not command.holds(self.state):
                    continue
                command = command.command
            before, after = self.state, apply(self.state, command)
            self.state = after
            for effects in self.followers:
                effects.follow(command, before, after)

    def work(self, serial: int = 7, without: tuple[str, ...] = ()) -> None:
        """Everything that was asked of the worker, but for requests of these names."""
        while self.asked:
            request = self.asked.pop(0)
            if type(request).__name__ in without:
                continue
            if isinstance(request, Job):
                self.perform(request.run(serial, lambda *_: None, lambda: False))
                continue
            for command in request.run(lambda: False):
                about = isinstance(request, SceneTask)
                self.perform(OfScene(request.serial, command) if about else command)

    def pass_time(self, seconds: float) -> None:
        self.perform(Tick(self.state.now + seconds))
        for effects in self.followers:
            effects.tick(self.state, self.state.now)


@dataclass
class Desk(Bare):
    """With what keeps the session."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.keeper = Keeper()
        self.effects = RecoveryEffects(self.hands, self.keeper)
        self.followers = (self.effects,)

    def written(self) -> None:
        """Once the writer's thread has done all that it was given."""
        self.effects._write(lambda: None).result(timeout=10)

    def die(self) -> None:
        """The system opens the lock of whoever does."""
        self.effects.close(self.state, crashed=True)
        if self.keeper._lock is not None:
            self.keeper._lock.close()

"""How a command line chooses an agent: a name, weights of its own, settings and a label."""

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from toponav.core.errors import InputError

__all__ = ["Choice", "imported_factory"]

Chosen = TypeVar("Chosen", bound="Choice")


@dataclass(frozen=True)
class Choice:
    """An agent as it is chosen for an evaluation; each suite's own kind knows its registry.

    Attributes:
        agent: Name in the registry, or `module:factory`.
        weights: Its own folder or preset of weights; None is what the evaluation says.
        options: Settings of the agent, as names and values.
        label: Name in the results.
    """

    agent: str
    weights: str | None = None
    options: tuple[tuple[str, str], ...] = ()
    label: str = ""

    def __post_init__(self) -> None:
        if not self.label:
            weights = f"={self.weights}" if self.weights else ""
            options = "".join(f",{name}={value}" for name, value in self.options)
            object.__setattr__(self, "label", f"{self.agent}{weights}{options}")
        if not self.label.isprintable() or len(self.label) > 120:
            raise InputError(
                f"a label is up to 120 printable characters, got {self.label[:40]!r}",
                where="--agent",
                remedy="give a shorter one with ,label=NAME",
            )

    @classmethod
    def parse(cls: type[Chosen], text: str) -> Chosen:
        """What `NAME`, `NAME=WEIGHTS` or `NAME=WEIGHTS,setting=value,label=LABEL` says.

        Example:
            >>> from toponav.evaluation.agents import AgentChoice
            >>> choice = AgentChoice.parse("graphnav_pf=compact,avoidance=off")
            >>> choice.agent, choice.weights, choice.options
            ('graphnav_pf', 'compact', (('avoidance', 'off'),))
            >>> choice.label
            'graphnav_pf=compact,avoidance=off'
        """
        first, *rest = text.split(",")
        name, _, weights = first.partition("=")
        options: dict[str, str] = {"weights": weights} if weights else {}
        for part in rest:
            key, equals, value = part.partition("=")
            if not equals or not key or not value or key in options:
                raise InputError(
                    f"'{part}' is no setting of its own",
                    where=f"--agent {text}",
                    remedy="write NAME=WEIGHTS,setting=value,label=LABEL; all but NAME may be "
                    "left out",
                )
            options[key] = value
        own, label = options.pop("weights", None), options.pop("label", "")
        return cls(name, own, tuple(options.items()), label)


def imported_factory(name: str, context: str) -> Callable[[Any], Any]:
    """The function that `module:factory` names.

    Args:
        name: As it was given.
        context: Name of what such a function takes.

    Raises:
        InputError: If it cannot be imported, or is no function.
    """
    module, _, attribute = name.partition(":")
    try:
        factory: Any = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        raise InputError(
            f"'{name}' cannot be imported: {error}",
            where="--agent",
            remedy="give module:factory of an installed module, or a name of the registry",
        ) from None
    if not callable(factory):
        raise InputError(
            f"'{name}' is not callable",
            where="--agent",
            remedy=f"name a function that takes {context} and returns an agent",
        )
    made: Callable[[Any], Any] = factory
    return made

"""The registry of the kinds of a role: which settings make which part.

A role is a part that can be exchanged: estimator, motion detector, link, arm. Each kind has a frozen dataclass of
settings, whose name is its YAML tag (``!ClosedPath {systematic_std: 0.002}``), and a maker that takes them. Makers are
named as "module:function", so that reading a scenario needs the registry but loads neither Drake nor OpenCV.
"""

import dataclasses
import importlib
import inspect
import re
from collections.abc import Callable, Collection, Mapping
from typing import Any, Generic, TypeVar, Union

from drake_tracker.core.errors import DrakeTrackerError

Part = TypeVar("Part")


class Registry(Generic[Part]):
    """The registry of one role.

    Args:
        role: name of the role for messages, for example "estimator".
        makers: {dataclass of settings: callable that makes a part from an instance of it, or its name
            "module:attribute"}. The first is the default.

    Attributes:
        role: name of the role.
        makers: {dataclass of settings: maker or its name}.
        names: {name in lower case with underscores: dataclass of settings}, for example "closed_path".
    """

    def __init__(self, role: str, makers: Mapping[type, Callable[..., Part] | str]) -> None:
        self.role = role
        self.makers = dict(makers)
        self.names = {snake_case(settings.__name__): settings for settings in makers}

    def union(self, *others: type, without: Collection[type] = ()) -> Any:
        """Returns the type of a scenario's field: the Union of the settings of the kinds.

        Args:
            *others: further members, such as `Custom`.
            without: kinds that the field does not offer.
        """
        return Union[(*(kind for kind in self.makers if kind not in without), *others)]

    def maker(self, settings_type: type) -> Callable[..., Part]:
        """Returns the callable that makes the parts of a kind; imports its module if it is given by name.

        Raises DrakeTrackerError when there is no such kind.
        """
        if settings_type not in self.makers:
            raise self._unknown(settings_type)
        maker = self.makers[settings_type]
        if isinstance(maker, str):
            module, _, name = maker.partition(":")
            return getattr(importlib.import_module(module), name)
        return maker

    def make(self, settings: Any, /, **context: Any) -> Part:
        """Returns the part that an instance of one of the settings describes.

        Args:
            settings: an instance of one of the dataclasses in ``makers``.
            **context: what the part needs in addition, such as ``period``. A maker is passed only the keywords that it
                accepts.

        Raises DrakeTrackerError when the settings belong to no kind of this role.
        """
        if type(settings) not in self.makers:
            raise self._unknown(settings)
        maker = self.maker(type(settings))
        accepted = inspect.signature(maker).parameters
        return maker(settings, **{name: value for name, value in context.items() if name in accepted})

    def make_by_name(self, kind: str, **parameters: Any) -> Part:
        """Returns the part of the kind with a given name, such as "closed_path".

        Args:
            kind: one of ``names``.
            **parameters: settings of the kind, and further keywords of its maker.

        Raises DrakeTrackerError for an unknown kind or parameter, or a value out of range.
        """
        if not isinstance(kind, str) or kind not in self.names:
            raise self._unknown(kind)
        settings_type = self.names[kind]
        maker = self.maker(settings_type)
        own = [field.name for field in dataclasses.fields(settings_type)]
        extra = list(inspect.signature(maker).parameters)[1:]
        for name in parameters:
            if name not in own and name not in extra:
                raise DrakeTrackerError(f"{kind} has no parameter {name!r}; it has {', '.join([*own, *extra])}")
        settings = settings_type(**{name: value for name, value in parameters.items() if name in own})
        try:
            return maker(settings, **{name: value for name, value in parameters.items() if name not in own})
        except TypeError as error:  # a keyword without a default is missing
            raise DrakeTrackerError(f"{kind}: {error}") from error

    def _unknown(self, kind: Any) -> DrakeTrackerError:
        return DrakeTrackerError(f"{self.role}: kind is {kind!r}; allowed are {', '.join(sorted(self.names))}")


def snake_case(name: str) -> str:
    """Returns a class name in lower case with underscores: "ClosedPath" gives "closed_path"."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()

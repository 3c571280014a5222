"""The message type of ``/tf``, also where ``tf2_msgs`` is not installed, as with the wheels.

A ``tf2_msgs/msg/TFMessage`` is nothing but a list of ``geometry_msgs/msg/TransformStamped``. Where
its package is missing, what the middleware asks of a type is put together from that of its
elements: name, hash (REP 2016), structure and description. Such a type
carries bytes alone, as :func:`khr_common.cdr.transforms` makes them; any ROS 2 with ``tf2_msgs``
reads them.
"""

from __future__ import annotations

import ctypes
from ctypes import (
    POINTER,
    Structure,
    byref,
    c_bool,
    c_char_p,
    c_size_t,
    c_ubyte,
    c_uint32,
    c_uint64,
    c_void_p,
    cast,
)
from functools import cache
from typing import Any

PACKAGE, NAME = 'tf2_msgs', 'TFMessage'
ELEMENT = b'geometry_msgs/msg/TransformStamped'
# RIHS01 of tf2_msgs/msg/TFMessage, behind its version.
HASH = bytes.fromhex('01e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087')
_FAST, _STRUCTURE = b'rosidl_typesupport_fastrtps_c', b'rosidl_typesupport_introspection_c'
_MESSAGE = 18  # a nested message: rosidl_typesupport_introspection_c__ROS_TYPE_MESSAGE
_UNBOUNDED_SEQUENCE = 145  # of nested types: type_description_interfaces/msg/FieldType


class _Support(Structure):
    """A rosidl_message_type_support_t."""


_Handle = ctypes.CFUNCTYPE(c_void_p, POINTER(_Support), c_char_p)
_Getter = ctypes.CFUNCTYPE(c_void_p, POINTER(_Support))
_Support._fields_ = [
    ('identifier', c_char_p),
    ('data', c_void_p),
    ('handle', _Handle),
    ('hash', _Getter),
    ('description', _Getter),
    ('sources', _Getter),
]


class _Callbacks(Structure):
    """A message_type_support_callbacks_t; who sends and receives bytes alone calls none of it."""

    _fields_ = (('namespace', c_char_p), ('name', c_char_p), ('functions', c_void_p * 5))


class _Member(Structure):
    """A rosidl_typesupport_introspection_c__MessageMember."""

    _fields_ = (
        ('name', c_char_p),
        ('kind', c_ubyte),
        ('text_bound', c_size_t),
        ('type', c_void_p),
        ('is_key', c_bool),
        ('is_array', c_bool),
        ('size', c_size_t),
        ('is_bounded', c_bool),
        ('offset', c_uint32),
        ('default_and_functions', c_void_p * 7),
    )


class _Members(Structure):
    """A rosidl_typesupport_introspection_c__MessageMembers."""

    _fields_ = (
        ('namespace', c_char_p),
        ('name', c_char_p),
        ('count', c_uint32),
        ('size', c_size_t),
        ('has_key', c_bool),
        ('members', c_void_p),
        ('functions', c_void_p * 2),
    )


class _Text(Structure):
    _fields_ = (('data', c_char_p), ('size', c_size_t), ('capacity', c_size_t))


class _Sequence(Structure):
    _fields_ = (('data', c_void_p), ('size', c_size_t), ('capacity', c_size_t))


class _FieldType(Structure):
    _fields_ = (
        ('kind', c_ubyte),
        ('capacity', c_uint64),
        ('text_capacity', c_uint64),
        ('nested', _Text),
    )


class _Field(Structure):
    _fields_ = (('name', _Text), ('kind', _FieldType), ('default', _Text))


class _Individual(Structure):
    _fields_ = (('name', _Text), ('fields', _Sequence))


class _Description(Structure):
    _fields_ = (('own', _Individual), ('referenced', _Sequence))


@cache
def transform_message() -> type[Any]:
    """Return the class of ``tf2_msgs/msg/TFMessage``, or one that stands for it."""
    try:
        from tf2_msgs.msg import TFMessage
    except ImportError:
        return _stand_in()
    found: type[Any] = TFMessage
    return found


def _stand_in() -> type[Any]:
    from geometry_msgs.msg import TransformStamped

    TransformStamped.__class__.__import_type_support__()
    element = _of_capsule(TransformStamped.__class__._TYPE_SUPPORT)
    # All of it lives as long as the process: the middleware keeps addresses.
    number = (c_ubyte * len(HASH))(*HASH)
    description, *parts = _description(element)
    fast, structure = _callbacks(element), _Members()
    member = _Member(b'transforms', _MESSAGE, type=element.handle(byref(element), _STRUCTURE))
    member.is_array = True
    structure.namespace, structure.name = f'{PACKAGE}__msg'.encode(), NAME.encode()
    structure.count, structure.size = 1, ctypes.sizeof(_Sequence)
    structure.members = ctypes.addressof(member)
    supports = {_FAST: _Support(_FAST, ctypes.addressof(fast))}
    supports[_STRUCTURE] = _Support(_STRUCTURE, ctypes.addressof(structure))
    addresses = {name: ctypes.addressof(support) for name, support in supports.items()}
    for support in supports.values():
        support.handle = _Handle(lambda _, wanted: addresses.get(wanted))
        support.hash = _Getter(lambda _: ctypes.addressof(number))
        support.description = _Getter(lambda _: ctypes.addressof(description))
        support.sources = element.sources

    class Meta(type(TransformStamped)):  # type: ignore[misc]
        _TYPE_SUPPORT = _capsule(addresses[_FAST])
        _KEPT = (number, description, parts, fast, structure, member, supports)

        @classmethod
        def __import_type_support__(cls) -> None:
            """Do nothing: the type is complete."""

    return Meta(NAME, (), {'__module__': f'{PACKAGE}.msg'})


def _callbacks(element: _Support) -> _Callbacks:
    """Return what serializes a message; it is never called, as the message goes as bytes."""
    within = cast(element.handle(byref(element), _FAST), POINTER(_Support)).contents
    found = _Callbacks.from_buffer_copy(cast(within.data, POINTER(_Callbacks)).contents)
    found.namespace, found.name = f'{PACKAGE}::msg'.encode(), NAME.encode()
    return found


def _description(element: _Support) -> tuple[Any, ...]:
    """Return the description of a message with one field, a sequence of elements; and its parts."""
    nested = cast(element.description(byref(element)), POINTER(_Description)).contents
    below = (_Individual * nested.referenced.size).from_address(nested.referenced.data)
    of_name = lambda each: each.name.data  # noqa: E731
    individuals = (_Individual * (len(below) + 1))(*sorted([*below, nested.own], key=of_name))
    kind = _FieldType(_UNBOUNDED_SEQUENCE, 0, 0, _text(ELEMENT))
    fields = (_Field * 1)(_Field(_text(b'transforms'), kind, _text(b'')))
    own = _Individual(_text(f'{PACKAGE}/msg/{NAME}'.encode()), _sequence(fields))
    return _Description(own, _sequence(individuals)), nested, individuals, fields


def _text(data: bytes) -> _Text:
    return _Text(data, len(data), len(data) + 1)


def _sequence(items: Any) -> _Sequence:
    return _Sequence(ctypes.addressof(items), len(items), len(items))


def _of_capsule(capsule: Any) -> _Support:
    read = ctypes.pythonapi.PyCapsule_GetPointer
    read.restype, read.argtypes = c_void_p, (ctypes.py_object, c_char_p)
    return cast(read(capsule, None), POINTER(_Support)).contents


def _capsule(address: int) -> Any:
    make = ctypes.pythonapi.PyCapsule_New
    make.restype, make.argtypes = ctypes.py_object, (c_void_p, c_char_p, c_void_p)
    return make(address, None, None)

"""Exceptions of the package. Each carries the one line that the program prints."""


class Error(Exception):
    """Any error of lightpaths."""


class UsageError(Error, ValueError):
    """A value that cannot be used: the value found, and the values expected."""


class UnknownNameError(UsageError, KeyError):
    """A name that does not exist: names that exist, and a similar one."""

    # A KeyError prints its line in quotation marks.
    __str__ = Exception.__str__


class FileError(Error, OSError):
    """A file that cannot be read or written, or that holds an error."""


class DeviceError(Error, RuntimeError):
    """No device, too little memory, or a failure of the device."""

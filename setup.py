"""Lists the packages for pip: the root folder is `scan_relight`, its sub-folders are what lies below."""

from setuptools import find_packages, setup

setup(packages=["scan_relight", *(f"scan_relight.{name}" for name in find_packages(include=["addon*", "operators*"]))])

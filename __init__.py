"""Scan Relight: from a posed HDR capture of a room to a Blender scene that can be relit."""


def register():
    """Register the operators and the command line; called by Blender."""
    from . import operators
    from .addon import cli

    operators.register()
    cli.register()


def unregister():
    """Take back everything that `register` did."""
    from . import operators
    from .addon import cli

    cli.unregister()
    operators.unregister()

"""The stages as the paper has them (`paper/`), in the pipeline's own types.

The method says nothing of what a scene to be lit anew needs besides: which objects are lamps (those whose albedo would
be above `lamps.EMITTER_ALBEDO`), and what colour has what no frame saw (its object's). That is added here.
"""

"""The live picture in a browser and in a notebook.

One file is one part on the way of a click: ``live.js`` (the page), ``server`` or ``live_picture`` (who brings its
events), ``channel``, ``session`` (takes events, renders, makes frames), ``renderer_state`` (settings → renderer). A new
event is a row of ``channel.EVENTS`` and a method ``on_…`` of ``session.Session``; a new setting needs neither: it is a
field of ``RenderSettings``.
"""

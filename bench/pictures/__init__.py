"""Pictures for the documentation, rendered by stock Mitsuba from scenes of the catalogue."""

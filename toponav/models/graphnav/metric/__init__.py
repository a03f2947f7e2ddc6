"""GraphNav with a pose belief: the parts that know metres."""

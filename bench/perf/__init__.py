"""Speed, measured side by side against a named peer or limit; run each by ``python -m``."""

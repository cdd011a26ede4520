"""The window: it joins models and views to widgets, one small binder each, and decides nothing itself."""

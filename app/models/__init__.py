"""What the window shows and does, without a window: observable models that know no Qt."""

"""Objects that show what is behind them."""

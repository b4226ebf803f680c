"""ACCESS-AV."""

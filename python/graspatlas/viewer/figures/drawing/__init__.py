"""What figures are drawn with: polygons of charts in three dimensions."""

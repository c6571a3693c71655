use super::{LooseOctree, Slot, cell::Cell};

impl LooseOctree {
    pub(super) fn check(&self) -> Result<(), String> {
        let mut inserted = 0;
        for (number, &Slot { chain, polygons }) in self.slots.iter().enumerate() {
            self.buckets.validate_chain(chain, number as u32)?;
            let mut own = 0;
            for (spot, item) in self.buckets.items(chain) {
                own += 1;
                if self.spot.get(item.id) != spot || self.inserted.get(item.id) != item.bounds {
                    return Err(format!("polygon {} has another spot or box", item.id.0));
                }
                if self.cell_for(&item.bounds) != number {
                    return Err(format!("polygon {} belongs to another cell", item.id.0));
                }
                let is_outside = number == self.outside();
                if !is_outside && !self.grid.loose_box(&self.grid.cell_at(number)).contains(&item.bounds) {
                    return Err(format!("polygon {} sticks out of its loose cell", item.id.0));
                }
            }
            inserted += own;
            let below: u32 =
                if number == self.outside() { 0 } else { self.count_below(&self.grid.cell_at(number)) };
            if polygons != own + below {
                return Err(format!("cell {number} counts {polygons}, has {own} and {below} below"));
            }
        }
        if inserted as usize != self.inserted.len() {
            return Err(format!("{inserted} polygons in cells, {} inserted", self.inserted.len()));
        }
        Ok(())
    }

    fn count_below(&self, cell: &Cell) -> u32 {
        if cell.level == self.grid.max_depth {
            return 0;
        }
        (0..8).map(|i| self.slots[cell.child(i).number as usize].polygons).sum()
    }
}

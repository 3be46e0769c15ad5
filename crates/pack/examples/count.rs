use raystrips_pack::*;
use std::collections::BTreeMap;
fn sbits(lo:i64,hi:i64)->u32{ let mut b=0; loop{ let (l,h)= if b==0 {(0,0)} else {(-(1i64<<(b-1)),(1i64<<(b-1))-1)}; if lo>=l&&hi<=h {return b;} b+=1; } }
fn ubits(lo:i64,hi:i64)->u32{ 64-((hi-lo) as u64).leading_zeros() }
fn unit_exponent(x:f32)->i32{ let bits=x.to_bits(); let (b,f)=((bits>>23&0xff) as i32,bits&0x7fffff); let (m,e)= if b==0 {(f,-149)} else {(f|0x800000,b-150)}; e+m.trailing_zeros() as i32 }
fn main(){
  for path in std::env::args().skip(1){
  use std::io::*; let mut file=std::fs::File::open(&path).unwrap(); let pack=Pack::open(&mut file).unwrap();
  
  let (mut segs,mut clusters,mut chunks,mut windows,mut cur)=(0u64,0u64,0u64,0u64,0u64);
  let mut tot: BTreeMap<String,f64>=BTreeMap::new();
  let mut order_hist=[0u64;5];
  for p in 0..pack.directory.len(){
    let e=pack.directory[p]; let mut buf=vec![0u64;(e.bytes as usize+7)/8+8]; let off=(64-(buf.as_ptr() as usize&63))&63; let b:&mut [u8]=bytemuck::cast_slice_mut(&mut buf); let b=&mut b[off..off+e.bytes as usize]; file.seek(SeekFrom::Start(e.offset)).unwrap(); file.read_exact(b).unwrap(); let page=PageView::new(b).unwrap();
    for c in 0..page.cluster_count(){
      let cl=page.cluster(c);
      let strands:Vec<_>=cl.strips().filter_map(|s|s.strand()).collect();
      if strands.is_empty(){continue;}
      clusters+=1; windows+=strands.len() as u64; cur+=cl.vertex_code().byte_count() as u64;
      segs+=strands.iter().map(|s|s.segments as u64).sum::<u64>();
      let mut w:Vec<(usize,usize,Vec<u8>)>=strands.iter().map(|s|(s.first as usize,s.segments,s.radii[..=s.segments].to_vec())).collect();
      w.sort_by_key(|x|x.0);
      let mut ch:Vec<(usize,usize,Vec<u8>,usize)>=vec![];
      for x in w{ match ch.last_mut(){ Some(l) if l.3==1 && l.0+l.1==x.0 =>{l.1+=x.1; l.2.extend(&x.2[1..]); l.3+=1;} _=>ch.push((x.0,x.1,x.2,1)) } }
      chunks+=ch.len() as u64;
      let n=cl.vertex_count();
      let v:Vec<[f32;3]>=(0..n).map(|i|cl.vertex(i as u8).to_array()).collect();
      // q per axis in units
      let q:Vec<Vec<i64>>=(0..3).map(|a|{ let e=v.iter().filter(|x|x[a]!=0.0).map(|x|unit_exponent(x[a])).min().unwrap_or(0); 
          let m=v.iter().map(|x|x[a].abs()).fold(0f32,f32::max) as f64*(-e as f64).exp2();
          if m<(1u64<<31) as f64 { v.iter().map(|x|((x[a] as f64)*(-e as f64).exp2()) as i64).collect()} else {v.iter().map(|x|x[a].to_bits() as i64).collect()} }).collect();
      let mut best=f64::MAX; let mut besto=0;
      for order in 0..=4usize {
        let mut bits=0f64; let mut rbits=0f64;
        // per class
        for a in 0..4 {
          let mut lo=[0i64;5]; let mut hi=[0i64;5]; let mut cnt=[0u64;5];
          let mut l0=i64::MAX; let mut h0=i64::MIN;
          for (f,s,r,_) in &ch {
            let mut d:Vec<i64>= if a<3 {(0..=*s).map(|k|q[a][f+k]).collect()} else {r.iter().map(|&x|x as i64).collect()};
            l0=l0.min(d[0]); h0=h0.max(d[0]);
            for k in 1..=order.min(*s) { for j in (k..d.len()).rev(){ d[j]-=d[j-1]; } }
            // now d[j] for j<order is j-th difference
            for (j,&x) in d.iter().enumerate(){ let cl=j.min(order); if cl>0||order==0&&j>0 {lo[cl]=lo[cl].min(x);hi[cl]=hi[cl].max(x);} if order==0 {l0=l0.min(x);h0=h0.max(x);} cnt[cl]+=1; }
          }
          let mut t=0f64;
          for k in 0..=order { let b= if k==0 {ubits(l0,h0)} else {sbits(lo[k],hi[k])}; t+=b as f64*cnt[k] as f64; }
          if a<3 {bits+=t} else {rbits+=t}
        }
        *tot.entry(format!("order{order} xyz")).or_default()+=bits/8.0;
        *tot.entry(format!("order{order} r")).or_default()+=rbits/8.0;
        if bits+rbits<best {best=bits+rbits;besto=order;}
      }
      *tot.entry("best order xyzr".into()).or_default()+=best/8.0; order_hist[besto]+=1;
      // midpoint hierarchical for chunks; generic recursion over [lo,hi]
      let mut cls:[BTreeMap<usize,(i64,i64,u64)>;4]=Default::default();
      for (f,s,r,_) in &ch { for a in 0..4 {
          let d:Vec<i64>= if a<3 {(0..=*s).map(|k|q[a][f+k]).collect()} else {r.iter().map(|&x|x as i64).collect()};
          fn rec(d:&[i64],lo:usize,hi:usize,depth:usize,m:&mut BTreeMap<usize,(i64,i64,u64)>){ if hi-lo<2 {return;} let mid=(lo+hi+1)/2; let p=d[lo]+((d[hi]-d[lo])*(mid-lo) as i64).div_euclid((hi-lo) as i64); let e=d[mid]-p; let x=m.entry(depth).or_insert((0,0,0)); x.0=x.0.min(e);x.1=x.1.max(e);x.2+=1; rec(d,lo,mid,depth+1,m); rec(d,mid,hi,depth+1,m);}
          let e=d[*s]-d[0]; let x=cls[a].entry(1).or_insert((0,0,0)); x.0=x.0.min(e);x.1=x.1.max(e);x.2+=1;
          let x=cls[a].entry(0).or_insert((d[0],d[0],0)); x.0=x.0.min(d[0]);x.1=x.1.max(d[0]);x.2+=1;
          rec(&d,0,*s,2,&mut cls[a]);
      }}
      for a in 0..4 { for (k,(lo,hi,n)) in &cls[a] { let b=if *k==0 {ubits(*lo,*hi)} else {sbits(*lo,*hi)}; *tot.entry(if a<3 {"mid xyz"} else {"mid r"}.into()).or_default()+=b as f64**n as f64/8.0; } }
    }
  }
  println!("{path}: segs {segs} clusters {clusters} chunks {chunks} windows {windows}; seg/cluster {:.1} current {:.3} B/seg orders {order_hist:?}",segs as f64/clusters as f64,cur as f64/segs as f64);
  for (k,t) in tot{ println!("  {k}: {:.3}",t/segs as f64);}
  }
}
